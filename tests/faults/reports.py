"""Opens the report of each capture in headless Chromium: `python -m tests.faults.reports captures/findings`.

The sentence of every finding must stand on the page as a person sees it, and nothing may be fetched or fail.
"""

from __future__ import annotations

import html
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from sniff.testing.capture_reading import read_capture

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--dump-dom",
)


def open_report(capture: Path, folder: Path) -> list[str]:
    """What is wrong with the page of one capture; empty when nothing is."""
    page = folder / f"{capture.name}.html"
    subprocess.run([sys.executable, "-m", "sniff", "report", str(capture), "-o", str(page)], check=True, timeout=120,
                   capture_output=True)  # fmt: skip
    command = ["chromium", *FLAGS, f"--user-data-dir={folder / 'profile'}", page.as_uri()]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    text = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", ran.stdout)).split()).lower()
    missing = [
        f"{finding.code} not on the page: {finding.seen}"
        for finding in read_capture(capture).findings
        if " ".join(finding.seen.split()).lower() not in text
    ]
    wrong = re.findall(r"CONSOLE.*|Refused to .*|net::ERR.*", ran.stderr)
    fetched = re.findall(r"(?:src|href)=[\"']https?://[^\"']*", ran.stdout)
    return missing + wrong + fetched


def main(words: list[str]) -> int:
    """Print one line a capture; exit code 1 when a page is wrong."""
    if shutil.which("chromium") is None:
        print("chromium is not installed")
        return 2
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        for capture in sorted(Path(words[0]).glob("*.cap.txt")):
            trouble = open_report(capture, Path(name))
            bad += bool(trouble)
            print(f"{'BAD ' if trouble else 'ok  '} {capture.name}  {'; '.join(trouble)}", flush=True)
    print(f"{bad} pages are wrong" if bad else "all pages are right")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
