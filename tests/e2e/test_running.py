"""Reading a process by lines and then to its end loses none of its lines."""

from __future__ import annotations

import subprocess
import sys
from subprocess import PIPE

from tests.e2e.running import rest_of

SAYS = r"import os; os.write(1, b'one\ntwo\nthree\n'); os.write(2, b'a\nb\n'); os.write(1, b'four\n')"
"""Lines that come together: reading the first takes more of them into the buffer."""


def test_lines_that_came_with_the_one_read_are_not_lost() -> None:
    with subprocess.Popen([sys.executable, "-c", SAYS], stdout=PIPE, stderr=PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == "one\n"
        assert process.stderr.readline() == "a\n"
        assert rest_of(process) == ("two\nthree\nfour\n", "b\n")
    assert process.returncode == 0
