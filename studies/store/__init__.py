"""Datasets in files: written whole, sealed, opened with care, joined from shards, reused."""
