"""Windows has no termios, fcntl and pty: no module of ours needs one merely to be imported."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.timeout(400)  # processes of their own, on a machine that may be busy

PROGRAM = """
import builtins, importlib, pkgutil

ABSENT = {"termios", "fcntl", "pty", "tty", "resource", "grp", "pwd", "syslog", "crypt"}
OURS = ("sniff", "dissectors")
plain = builtins.__import__

def without(name, globals=None, locals=None, fromlist=(), level=0):
    # libraries choose by the system that they find, which is not Windows here; so only ours are kept from it
    if name in ABSENT and level == 0 and (globals or {}).get("__name__", "").split(".")[0] in OURS:
        raise ModuleNotFoundError(f"{name}: there is no such module on Windows, for {globals['__name__']}")
    return plain(name, globals, locals, fromlist, level)

builtins.__import__ = without
count = 0
for package in map(importlib.import_module, OURS):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not found.name.endswith("__main__"):
            importlib.import_module(found.name)
            count += 1
print(count)
"""


def test_every_module_is_imported_without_what_windows_lacks() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout) > 500


def test_what_is_kept_away_is_kept_away() -> None:
    """The guard works: a module of ours that asked for one would be caught."""
    program = PROGRAM.partition("count = 0")[0] + "exec('import fcntl', {'__name__': 'sniff.x'})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "no such module on Windows, for sniff.x" in done.stderr
