"""Configuration identifiers of Chk_Cfg and Get_Cfg: what modules a slave has (IEC 61158-6-3; notes of pyprofibus).

general   c w t t n n n n      t 01 input, 10 output, 11 both; n+1 octets, or words with w; c: consistent as a whole
special   k k 0 0 m m m m      k 00 empty slot, 01 input, 10 output, 11 output and input: a length octet for each,
                               c w n n n n n n; then m octets of the maker's, none where m is 15
"""

from __future__ import annotations

from dataclasses import dataclass, replace

_NOT_COMPARED = 15
"""In place of a number of octets: none follow, and those that the slave has need not be the same."""


@dataclass(frozen=True, slots=True)
class Module:
    """`inputs`, `outputs`: octets. `words`: as people say it. `is_whole`: consistent as a whole. `begin`, `end`: its
    octets; `makers`: those of them that are the maker's."""

    inputs: int
    outputs: int
    words: str
    is_whole: bool
    begin: int = 0
    end: int = 0
    makers: bytes = b""

    @property
    def consistency(self) -> str:
        """What is consistent, in words; empty for an empty slot."""
        return ("as a whole" if self.is_whole else "by units") if self.inputs or self.outputs else ""


def parse_configuration(data: bytes) -> tuple[Module, ...]:
    """The modules that the identifiers name; total: one that is cut off is left out."""
    modules, at = [], 0
    while at < len(data):
        octet = data[at]
        if octet & 0x30:
            modules.append(replace(_general(octet), begin=at, end=at + 1))
            at += 1
            continue
        kinds = octet >> 6
        lengths = (kinds & 1) + (kinds >> 1)
        named = data[at + 1 : at + 1 + lengths]
        if len(named) < lengths:
            break
        behind = at + 1 + lengths
        makers = octet & 0x0F
        end = behind + (makers if makers != _NOT_COMPARED else 0)
        if end > len(data):
            break
        modules.append(replace(_special(kinds, named), begin=at, end=end, makers=data[behind:end]))
        at = end
    return tuple(modules)


def _general(octet: int) -> Module:
    count, unit = (octet & 0x0F) + 1, "word" if octet & 0x40 else "octet"
    size = count * (2 if octet & 0x40 else 1)
    inputs, outputs = size if octet & 0x10 else 0, size if octet & 0x20 else 0
    return Module(inputs, outputs, _words(count if inputs else 0, count if outputs else 0, unit), bool(octet & 0x80))


def _special(kinds: int, lengths: bytes) -> Module:
    """Output length first where there are both."""
    if not kinds:
        return Module(0, 0, "empty slot", False)
    sizes = [((octet & 0x3F) + 1) * (2 if octet & 0x40 else 1) for octet in lengths]
    outputs = sizes[0] if kinds & 2 else 0
    inputs = sizes[-1] if kinds & 1 else 0
    return Module(inputs, outputs, _words(inputs, outputs, "octet"), bool(lengths[0] & 0x80))


def _words(inputs: int, outputs: int, unit: str) -> str:
    if inputs == outputs:
        return f"{_counted(inputs, unit)} in and out"
    told = [f"{_counted(inputs, unit)} in"] if inputs else []
    return ", ".join([*told, f"{_counted(outputs, unit)} out"] if outputs else told)


def _counted(count: int, unit: str) -> str:
    return f"{count} {unit if count == 1 else unit + 's'}"
