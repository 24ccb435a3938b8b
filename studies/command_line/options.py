"""Options and arguments that several subcommands share, and how what is typed after them is read.

Where several values make sense they stand after commas, after spaces or after the option again; elsewhere a
second one is refused. What the values mean is decided by `elastica` and `studies`.
"""

import os
import re
from pathlib import Path

import click

from studies.system import refuse_windows_path


class Command(click.Command):
    """A subcommand that understands several values after an option, and refuses them where one is meant."""

    def parse_args(self, ctx, args):
        """Read the arguments."""
        return super().parse_args(ctx, list(self._spread(ctx, args)))

    def _spread(self, ctx, args):
        """The arguments, with an option of several values repeated before each of them."""
        options = self.get_params(ctx)
        named = {name: each for each in options if isinstance(each, click.Option) for name in each.opts}
        alone = not any(isinstance(each, click.Argument) for each in options)
        seen, option, name, waits = set(), None, "", False
        for position, arg in enumerate(args):
            word, equals, _ = arg.partition("=")
            if waits and word in named:
                raise click.UsageError(f"{name} needs a value; write it before {word}", ctx)
            if arg == "--":
                yield from args[position:]
                return
            if word in named:
                option, name = named[word], word
                if option in seen and not (option.multiple or option.is_flag):
                    raise click.UsageError(f"{name} is given twice; give it once", ctx)
                seen.add(option)
                waits = not (option.is_flag or equals)
            elif waits:
                waits = False
            elif option is None or option.is_flag or arg.startswith("--"):
                option = None
            elif alone or _holds(option.type, arg):
                if not option.multiple:
                    raise click.UsageError(f"{name} takes one value; leave out {arg!r}", ctx)
                yield name
            else:
                option = None
            yield arg


def _holds(kind, text):
    """Whether a text is clearly a value of this kind, and not the name of a file."""
    return isinstance(kind, (Number, Listed)) and kind.holds(text)


class Number(click.ParamType):
    """A number."""

    name = "number"

    def convert(self, value, param, ctx):
        """A float from a text."""
        try:
            return float(value)
        except ValueError:
            pass
        if isinstance(value, str) and self.holds(value):
            self.fail(f"{value!r} is more than one value; give one here", param, ctx)
        self.fail(f"{value!r} is not a number; write one such as 0.1", param, ctx)

    def holds(self, text):
        """Whether a text is a number, or several after commas."""
        try:
            return bool([float(part) for part in _parts(text)])
        except ValueError:
            return False


class Whole(click.IntRange):
    """A whole number from one to another."""

    def convert(self, value, param, ctx):
        """An int from a text."""
        if not isinstance(value, int):
            try:
                value = int(value)
            except ValueError:
                self.fail(f"{value!r} is not a whole number; write one such as 4", param, ctx)
        return super().convert(value, param, ctx)


class Address(click.ParamType):
    """The address of a dask scheduler."""

    name = "address"

    def convert(self, value, param, ctx):
        """The text, if there is a port in it."""
        if not re.fullmatch(r"([a-z]+://)?[^/\s]+:\d+", value):
            self.fail(f"{value!r} is no address; write one such as tcp://host:8786", param, ctx)
        return value


class Listed(click.ParamType):
    """Values after commas, as a tuple; `holds` tells whether a text is one of them."""

    def __init__(self, name, kind, is_value):
        self.name, self.kind, self.is_value = name, kind, is_value

    def convert(self, value, param, ctx):
        """Values from a text."""
        if isinstance(value, tuple):
            return value
        return tuple(self.kind.convert(part, param, ctx) for part in _parts(value)) or self.fail(
            "a value is missing; write one or several, such as 1,2", param, ctx
        )

    def holds(self, text):
        """Whether all of a text are values."""
        return bool(_parts(text)) and all(map(self.is_value, _parts(text)))


class Choice(click.Choice):
    """One of a few words."""

    def convert(self, value, param, ctx):
        """The word."""
        if value not in self.choices:
            from elastica.spelling import did_you_mean

            choices = ", ".join(self.choices)
            self.fail(f"{value!r} is not known{did_you_mean(value, self.choices)}; use {choices}", param, ctx)
        return super().convert(value, param, ctx)


class Output(click.Path):
    """The path of a file to write."""

    def __init__(self):
        super().__init__(path_type=Path)

    def convert(self, value, param, ctx):
        """A path from a text."""
        refuse_windows_path(value)
        return super().convert(value, param, ctx)


def _parts(text):
    return [part.strip() for part in text.split(",") if part.strip()]


def _is_state(text):
    from elastica.state import GRAMMAR

    return GRAMMAR.fullmatch(text) is not None


def _is_ends(text):
    from elastica.ends import parse_ends

    try:
        return bool(parse_ends(text))
    except ValueError:
        return False


NUMBER = Number()
NUMBERS = Listed("number,…", NUMBER, NUMBER.holds)
STATES = Listed("name,…", click.STRING, _is_state)
END_CONDITIONS = Listed("a-b|a/b,…", click.STRING, _is_ends)


def several(*names, kind, default=None, **attributes):
    """An option that takes several values: a tuple, empty if it is not given."""
    return click.option(
        *names,
        type=kind,
        multiple=True,
        default=None if default is None else [default],
        callback=lambda ctx, param, values: tuple(value for given in values or () for value in given),
        **attributes,
    )


STUDY = click.argument("study", type=click.Path(path_type=Path), metavar="STUDY.toml")
FILE = click.argument("file", type=click.Path(path_type=Path), metavar="FILE.nc")


OUTPUT = click.option("-o", "--output", type=Output(), help="Default: <study name>.nc here.")
FORCE = click.option(
    "--force-unlock", is_flag=True, help="Take over from a run on another host, which has ended."
)
REUSE = click.option(
    "--reuse", type=click.Path(path_type=Path), metavar="OTHER.nc", help="Take the points that are there."
)
JSON = click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print JSON instead: codes by their names, null for what does not exist.",
)


def writable(output):
    """Refuse a file in a folder that takes none.

    Raises
    ------
    StudyError
        If the folder does not exist or cannot be written to.
    """
    from studies.errors import StudyError

    if not output.parent.is_dir() or not os.access(output.parent, os.W_OK):
        raise StudyError(f"{output.parent}: this folder does not exist or cannot be written to")
