"""What texts point to is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXTS = [*ROOT.glob("*.md"), *ROOT.glob("notebooks/*.ipynb"), *ROOT.glob("catalogs/*.md")]
LINK = re.compile(r"\]\(([^)\s#]+)")


@pytest.mark.parametrize("text", TEXTS, ids=lambda path: path.name)
def test_links_lead_to_files(text):
    links = [link for link in LINK.findall(text.read_text(encoding="utf-8")) if "://" not in link]
    assert [link for link in links if not (text.parent / link).exists()] == []
    assert links or text.name != "README.md"
