"""Finished datasets kept, found again and checked."""
