"""Follow every link of the built site: pages, anchors and files must be there; those to elsewhere are listed only. ``make site``."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links of a page, and the places in it that links may lead to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what an element links to and is called."""
        found = dict(attrs)
        self.places |= {name for key in ("id", "name") if (name := found.get(key))}
        link = found.get("href" if tag in {"a", "link"} else "src")
        if link is not None:
            self.links.append(link)


def wrong_links(site: Path) -> tuple[list[str], set[str]]:
    """Return the links of a site that lead nowhere, each with its page, and the links to elsewhere."""
    # What the theme keeps beside its styles are no pages.
    paths = (path for path in sorted(site.rglob("*.html")) if "_static" not in path.parts)
    pages = {path: Page(path) for path in paths}
    wrong, elsewhere = [], set()
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                elsewhere |= {link} if parts.scheme in {"http", "https"} else set()
                continue
            place = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchor = unquote(parts.fragment)
            is_there = place.is_file() and (not anchor or place not in pages or anchor in pages[place].places)
            if not is_there:
                wrong.append(f"{path.relative_to(site)}: {link}")
    return wrong, elsewhere


if __name__ == "__main__":
    wrong, elsewhere = wrong_links(Path(sys.argv[1]).resolve())
    sys.stdout.write("".join(f"not fetched: {link}\n" for link in sorted(elsewhere)))
    if wrong:
        sys.exit("Links that lead nowhere:\n" + "\n".join(wrong))
