"""The scripts come with the package and are only printed here; where the shell looks for them, for instance:

sniff485 completion bash > ~/.local/share/bash-completion/completions/sniff485
sniff485 completion zsh > ~/.zfunc/_sniff485
sniff485 completion fish > ~/.config/fish/completions/sniff485.fish
"""

from __future__ import annotations

import argparse
import sys
import sysconfig
from pathlib import Path

from sniff.cli import UNREADABLE, Failure

SCRIPTS = {
    "bash": "share/bash-completion/completions/sniff485",
    "zsh": "share/zsh/site-functions/_sniff485",
    "fish": "share/fish/vendor_completions.d/sniff485.fish",
}
"""Where the package put them, below its prefix; docs/generate/completion.py makes them."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `completion`."""
    parser.add_argument("shell", choices=sorted(SCRIPTS), help="the shell that is to complete")


def run(args: argparse.Namespace) -> int:
    """Print a script."""
    for prefix in dict.fromkeys((sysconfig.get_path("data"), _user_prefix())):
        path = Path(prefix, SCRIPTS[args.shell])
        if path.is_file():
            sys.stdout.write(path.read_text(encoding="utf-8"))
            return 0
    raise Failure(
        f"{SCRIPTS[args.shell]}: not below {sys.prefix}: it is made while the package is built; install it with pip",
        UNREADABLE,
    )


def _user_prefix() -> str:
    import os

    return sysconfig.get_path("data", f"{os.name}_user")
