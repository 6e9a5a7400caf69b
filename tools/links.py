"""Check that every link of a built site leads to a place on it, and that nothing is missing.

Usage: python tools/links.py FOLDER

Checks the files only. Links to other hosts are not followed, but a script, style sheet, picture or
frame from another host is an error. The exit status is 1 if something is wrong.
"""

import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

from bs4 import BeautifulSoup


def wrong(site: Path) -> list[str]:
    """Return a line for each wrong link in the HTML files under a folder."""
    pages = {
        path.resolve(): BeautifulSoup(path.read_bytes(), "html.parser")
        for path in site.rglob("*.html")
    }
    anchors = {path: {tag["id"] for tag in page.find_all(id=True)} for path, page in pages.items()}
    lines = []
    for path, page in pages.items():
        for tag in page.find_all(lambda tag: tag.has_attr("href") or tag.has_attr("src")):
            link = tag.get("href") or tag.get("src") or ""
            url = urlsplit(link)
            if url.scheme or url.netloc:
                is_part = tag.has_attr("src") or "stylesheet" in tag.get("rel", [])
                bad = is_part and url.scheme != "data"
            else:
                target = (path.parent / unquote(url.path)).resolve() if url.path else path
                known = anchors.get(target, set())
                # The landscape's page keeps its state in the fragment: design=6453.
                place = "" if "=" in url.fragment else unquote(url.fragment)
                bad = not target.is_file() or (place and place not in known)
            if bad:
                lines.append(f"{path.relative_to(site.resolve())}: {tag.name} {link}")
    return lines


if __name__ == "__main__":
    found = wrong(Path(sys.argv[1]))
    print("\n".join(found) or "every link leads somewhere")
    sys.exit(bool(found))
