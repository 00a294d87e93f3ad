"""Stencils of Modbus RTU frames: units and functions, addresses, counts, the first ten registers."""

from __future__ import annotations

from functools import lru_cache

from dissectors.frame import Role
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.header import kind_of
from dissectors.stencil import Form, Needs, Stencil

_MOST_SHOWN = 10
"""Registers that a line shows, at most; a stencil that is wrong about it is not used."""
_CODES = {kind_of(code): code for code in FUNCTIONS}
_ASKED = 8
"""Octets of a read, of a written register, and of the answer to written ones, with the check."""


@lru_cache(1024)
def rtu_stencil(role: Role, kind: str, length: int) -> Stencil | None:
    """See `dissectors.stencil.Stencils`."""
    code = _CODES.get(kind)
    check = (length - 2, length - 1)
    if code is None:
        return None
    function = (1, 0xFF, code)
    if length == _ASKED and code == 5:  # its value is a word
        return Stencil((function,), check, ((2, Form.HEX),))
    if length == _ASKED and code in (1, 2, 3, 4, 6, 15, 16):
        return Stencil((function,), check, ((2, Form.HEX), (4, Form.DECIMAL)))
    if code in (3, 4) and role is Role.RESPONSE and 7 <= length <= 255 and length % 2:
        return _registers((function, (2, 0xFF, length - 5)), (), 3, (length - 5) // 2, check)
    if code == 16 and role is not Role.RESPONSE and 11 <= length <= 256 and length % 2:
        count = (length - 9) // 2
        needs = (function, (4, 0xFF, 0), (5, 0xFF, count), (6, 0xFF, 2 * count))
        return _registers(needs, ((2, Form.HEX),), 7, count, check)
    return None


def _registers(
    needs: Needs,
    before: tuple[tuple[int, Form], ...],
    begin: int,
    count: int,
    check: tuple[int, int],
) -> Stencil:
    shown = min(count, _MOST_SHOWN)
    numbers = tuple((begin + 2 * place, Form.DECIMAL) for place in range(shown))
    return Stencil(needs, (*range(begin + 2 * shown, begin + 2 * count), *check), (*before, *numbers))
