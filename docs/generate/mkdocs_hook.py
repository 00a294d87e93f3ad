"""What mkdocs calls: adds the generated pages and the pictures, and sees that a page needs nothing from elsewhere."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "captures" / "pictures"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Pages of commands, rules and fields; screens of the terminal UI."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    from docs.generate.command_pages import command_pages
    from docs.generate.field_pages import field_pages
    from docs.generate.rule_pages import rule_pages

    reference: list[object] = []
    for title, pages in (("Commands", command_pages()), ("Rules", rule_pages()), ("Fields", field_pages())):
        made = list(pages)
        for address, text in made:
            files.append(File.generated(config, address, content=text))
        reference.append({title: sorted((address for address, _ in made), key=_index_first)})
    assert isinstance(config.nav, list)
    config.nav = [*config.nav, {"Reference": reference}]
    for picture in sorted(PICTURES.glob("*.svg")):
        files.append(File.generated(config, f"pictures/{picture.name}", abs_src_path=str(picture)))
    return files


def _index_first(address: str) -> tuple[bool, str]:
    return not address.endswith("/index.md"), address


_FETCHED = re.compile(
    r"""<(?:script|img|iframe|link|source)\b[^>]*?\b(?:src|href)=["']?(?:https?:)?//[^"'\s>]*|url\(["']?(?:https?:)?//"""
)


def on_post_build(config: MkDocsConfig) -> None:
    """Nothing is fetched from a network by whoever reads the pages."""
    for path in sorted(Path(config.site_dir).rglob("*")):
        if path.suffix in (".html", ".css", ".svg"):
            found = _FETCHED.search(path.read_text(encoding="utf-8"))
            if found and 'rel="canonical"' not in found[0]:
                raise PluginError(f"{path.relative_to(config.site_dir)}: fetches something from elsewhere: {found[0]}")
