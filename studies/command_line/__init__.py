"""The `elastica` command. Each subcommand imports what it needs, so that `elastica solve` answers at once."""

from studies.command_line import accuracy, catalog, datasets, states, studies
from studies.command_line.group import main

__all__ = ["accuracy", "catalog", "datasets", "main", "states", "studies"]
