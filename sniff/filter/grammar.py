"""The grammar of filters: Wireshark's, from text to what it is made of (`syntax.py`). Pure.

filter     = [ either ]                                     an empty one accepts everything
either     = exclusive { ("||" | "or") exclusive }
exclusive  = both { ("^^" | "xor") both }
both       = not { ("&&" | "and") not }
not        = ("!" | "not") not | relation
relation   = [ "any" | "all" ] sum [ more ]                 alone: whether there is such a thing
more       = compare sum { compare sum }                    1 < dst < 5
           | [ "not" ] "in" "{" item { [","] item } "}"
           | "contains" sum | ("matches" | "~") sum
item       = sum [ ".." sum ]
compare    = "==" | "!=" | "===" | "!==" | "<" | "<=" | ">" | ">="     or eq ne all_eq any_ne lt le gt ge
sum        = product { ("+" | "-") product }                a minus sign stands between spaces: names have hyphens
product    = bits { ("*" | "/" | "%") bits }
bits       = signed { ("&" | "bitand") signed }
signed     = [ "-" | "+" ] sliced
sliced     = value { "[" part { "," part } "]" }            octets[2:2]  octets[-2:]  octets[0-3]  octets[5]
value      = "(" either ")" | function "(" sum { "," sum } ")" | word | number unit | "text"
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from sniff.filter.errors import FilterError
from sniff.filter.syntax import (
    Among,
    Arithmetic,
    Call,
    Compared,
    Contains,
    Joined,
    Matches,
    Not,
    Present,
    Quoted,
    Slice,
    Span,
    Test,
    Value,
    Word,
)

FUNCTIONS = ("len", "count", "lower", "upper", "min", "max", "abs", "string")
DEEPEST = 64
"""Parentheses, functions and signs inside one another; half as many parentheses."""
MOST_STEPS = 100
"""Arithmetic and slices in one filter."""

_COMPARE = ("===", "!==", "==", "!=", ">=", "<=", ">", "<")
_SPOKEN = {
    "eq": "==", "ne": "!=", "ge": ">=", "le": "<=", "gt": ">", "lt": "<", "all_eq": "===", "any_ne": "!==",
    "any_eq": "==", "all_ne": "!=", "and": "&&", "or": "||", "not": "!", "xor": "^^", "bitand": "&",
}  # fmt: skip
_LEXER = re.compile(
    r"\s*(?:(?P<op>===|!==|==|!=|>=|<=|&&|\|\||\^\^|\.\.|[><!(){},~&*/%+-])"
    r"|\[(?P<slice>[^\[\]]*)\]"
    r'|(?P<text>"(?:[^"\\]|\\.)*")'
    r"|(?P<word>[A-Za-z0-9_](?:[A-Za-z0-9_:]|-(?=[A-Za-z0-9_])|\.(?!\.))*))"
)
_PART = re.compile(
    r"\s*(?:(?P<at>-?\d{1,9})|(?P<first>-?\d{1,9})?:(?P<length>\d{1,9})?|(?P<from>\d{1,9})-(?P<to>\d{1,9}))\s*"
)

Node = Value | Test
_Reading = Callable[[], Node]
"""A rule of the grammar, read where the parser stands."""
_TESTS = (Present, Compared, Among, Contains, Matches, Not, Joined)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str  # "op", "slice", "text", "word", "end"
    text: str
    column: int


def parse(text: str) -> Test | None:
    """What a filter is made of; None for an empty one. Raises FilterError."""
    tokens = _lex(text)
    return None if len(tokens) == 1 else _Parser(tokens).filter()


def words_of(text: str) -> list[tuple[str, str, int]]:
    """Kind ("op", "slice", "text", "word"), text and column of what was typed, as far as it can be read."""
    try:
        return [(one.kind, one.text, one.column) for one in _lex(text)[:-1]]
    except FilterError as error:
        return [(one.kind, one.text, one.column) for one in _lex(text[: error.column])[:-1]]


def _lex(text: str) -> list[_Token]:
    tokens: list[_Token] = []
    position, end = 0, len(text.rstrip())
    while position < end:
        match = _LEXER.match(text, position)
        if match is None:
            column = position + len(text[position:]) - len(text[position:].lstrip())
            raise FilterError(_unreadable(text, column), column)
        kind = match.lastgroup or "op"
        found = match[kind]
        if kind == "word" and found in _SPOKEN:
            kind, found = "op", _SPOKEN[found]
        tokens.append(_Token(kind, found, match.start(match.lastgroup or "op")))
        position = match.end()
    tokens.append(_Token("end", "", end))
    return tokens


def _unreadable(text: str, column: int) -> str:
    found = text[column]
    if found == '"':
        return 'a text without its closing "'
    hints = {"=": "==", "|": "||", "^": "^^", "'": '"', "[": "[2:2] with its closing ]"}
    return f"unexpected {found!r}{f' (did you mean {hints[found]}?)' if found in hints else ''}"


class _Parser:
    def __init__(self, tokens: list[_Token]) -> None:
        self.tokens = tokens
        self.at = 0
        self.depth = 0
        self.steps = 0

    def filter(self) -> Test:
        found = self._either()
        if self._now.kind != "end":
            raise FilterError(f"expected && or || before {self._shown()}", self._now.column)
        return self._test(found)

    def _either(self) -> Node:
        return self._joined("||", self._exclusive)

    def _exclusive(self) -> Node:
        return self._joined("^^", self._both)

    def _both(self) -> Node:
        return self._joined("&&", self._not)

    def _joined(self, operator: str, part: _Reading) -> Node:
        first = part()
        if not self._is(operator):
            return first
        parts = [self._test(first)]
        while self._take(operator):
            parts.append(self._test(part()))
        return Joined(operator, tuple(parts))

    def _not(self) -> Node:
        self._deeper()
        try:
            if self._take("!"):
                return Not(self._test(self._not()))
            return self._relation()
        finally:
            self.depth -= 1

    def _relation(self) -> Node:
        quantifier = ""
        if self._now.kind == "word" and self._now.text in ("any", "all") and self.tokens[self.at + 1].kind == "word":
            quantifier = self._next().text
        left = self._sum()
        if isinstance(left, _TESTS):
            return left
        token = self._now
        if token.kind == "op" and token.text in _COMPARE:
            return self._compared(left, quantifier)
        negated = token.kind == "op" and token.text == "!" and self.tokens[self.at + 1].text == "in"
        if negated:
            self._next()
        if self._keyword("in"):
            among = Among(left, self._items(), token.column, quantifier)
            return Not(among) if negated else among
        if self._keyword("contains"):
            return Contains(left, self._value_after("contains"), token.column, quantifier)
        if self._keyword("matches") or self._take("~"):
            return Matches(left, self._value_after("matches"), token.column, quantifier)
        if quantifier:
            raise FilterError(f"expected a comparison behind {quantifier}", token.column)
        return left

    def _compared(self, left: Value, quantifier: str) -> Test:
        parts: list[Test] = []
        while self._now.kind == "op" and self._now.text in _COMPARE:
            token = self._next()
            right = self._value_after(token.text)
            parts.append(Compared(token.text, left, right, token.column, quantifier))
            left = right
        return parts[0] if len(parts) == 1 else Joined("&&", tuple(parts))

    def _items(self) -> tuple[tuple[Value, Value | None], ...]:
        if not self._take("{"):
            raise FilterError("expected { after in", self._now.column)
        items: list[tuple[Value, Value | None]] = []
        while not self._is("}"):
            if items:
                self._take(",")
            if self._now.kind == "end":
                raise FilterError("expected } at the end of the set" if items else "expected a value", self._now.column)
            low = self._value_after("in")
            items.append((low, self._value_after("..") if self._take("..") else None))
        if not items:
            raise FilterError("expected a value in the set", self._now.column)
        self._next()
        return tuple(items)

    # values

    def _value_after(self, what: str) -> Value:
        column = self._now.column
        found = self._sum()
        if isinstance(found, _TESTS):
            raise FilterError(f"expected a value after {what}, not a test", column)
        return found

    def _sum(self) -> Node:
        return self._arithmetic(("+", "-"), self._product)

    def _product(self) -> Node:
        return self._arithmetic(("*", "/", "%"), self._bits)

    def _bits(self) -> Node:
        return self._arithmetic(("&",), self._signed)

    def _arithmetic(self, operators: tuple[str, ...], part: _Reading) -> Node:
        left = part()
        while self._now.kind == "op" and self._now.text in operators:
            token = self._step()
            if isinstance(left, _TESTS):
                raise FilterError(f"expected a number before {token.text}, not a test", token.column)
            right = part()
            if isinstance(right, _TESTS):
                raise FilterError(f"expected a number after {token.text}, not a test", token.column)
            left = Arithmetic(token.text, left, right, token.column)
        return left

    def _signed(self) -> Node:
        token = self._now
        if token.kind == "op" and token.text in ("-", "+"):
            self._next()
            inner = self._sliced()
            if isinstance(inner, _TESTS):
                raise FilterError(f"expected a number after {token.text}", token.column)
            if token.text == "+":
                return inner
            if isinstance(inner, Word) and inner.text[0].isdigit():
                return Word(f"-{inner.text}", token.column)
            return Arithmetic("-", Word("0", token.column), inner, token.column)
        return self._sliced()

    def _sliced(self) -> Node:
        found = self._primary()
        while self._now.kind == "slice":
            token = self._step()
            if isinstance(found, _TESTS):
                raise FilterError("a test has no octets", token.column)
            found = Slice(found, _spans(token), token.column)
        return found

    def _primary(self) -> Node:
        token = self._now
        if self._take("("):
            self._deeper()
            found = self._either()
            self.depth -= 1
            if not self._take(")"):
                raise FilterError("expected )", self._now.column)
            return found
        if token.kind == "text":
            self._next()
            _escapes(token)
            return Quoted(re.sub(r"\\(.)", r"\1", token.text[1:-1]), token.column)
        if token.kind != "word":
            before = self.tokens[self.at - 1] if self.at else None
            if before is not None and (before.text in _COMPARE or before.text in _BEFORE_VALUES):
                raise FilterError(f"expected a value{self._found()}", token.column)
            raise FilterError(f"expected a name such as dst, kind or latency_ms{self._found()}", token.column)
        self._next()
        if self._is("(") and self._now.column == token.column + len(token.text):
            return self._call(token)
        return Word(token.text + self._unit(token), token.column)

    def _unit(self, token: _Token) -> str:
        """The unit behind a number: 30 Hz."""
        now = self._now
        if not token.text[0].isdigit() or now.kind != "word" or now.text[0].isdigit() or now.text in _BEFORE_VALUES:
            return ""
        self._next()
        return f" {now.text}"

    def _call(self, token: _Token) -> Value:
        if token.text not in FUNCTIONS:
            raise FilterError(f"unknown function {token.text!r} (there are {', '.join(FUNCTIONS)})", token.column)
        self._next()
        self._deeper()
        arguments = [self._value_after("(")]
        while self._take(","):
            arguments.append(self._value_after(","))
        self.depth -= 1
        if not self._take(")"):
            raise FilterError("expected )", self._now.column)
        if len(arguments) > 1 and token.text not in ("min", "max"):
            raise FilterError(f"{token.text}() takes one value", token.column)
        return Call(token.text, tuple(arguments), token.column)

    # tokens

    @property
    def _now(self) -> _Token:
        return self.tokens[self.at]

    def _next(self) -> _Token:
        self.at += 1
        return self.tokens[self.at - 1]

    def _step(self) -> _Token:
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise FilterError("too much arithmetic", self._now.column)
        return self._next()

    def _is(self, text: str) -> bool:
        return self._now.kind == "op" and self._now.text == text

    def _take(self, text: str) -> bool:
        if self._is(text):
            self.at += 1
            return True
        return False

    def _keyword(self, text: str) -> bool:
        if self._now.kind == "word" and self._now.text == text:
            self.at += 1
            return True
        return False

    def _deeper(self) -> None:
        self.depth += 1
        if self.depth > DEEPEST:
            raise FilterError("too deeply nested", self._now.column)

    def _shown(self) -> str:
        return f"[{self._now.text}]" if self._now.kind == "slice" else repr(self._now.text)

    def _found(self) -> str:
        return "" if self._now.kind == "end" else f", not {self._shown()}"

    def _test(self, found: Node) -> Test:
        """A value alone asks whether there is such a thing."""
        if isinstance(found, Quoted):
            return Contains(Word("text", found.column), found, found.column, alike=True)
        return found if isinstance(found, _TESTS) else Present(found, found.column)


_BEFORE_VALUES = frozenset((",", "contains", "matches", "~", "in", "{", "..", "+", "-", "*", "/", "%", "&"))


def _escapes(token: _Token) -> None:
    """Refuse escapes of octets that lack their digits."""
    for match in re.finditer(r"\\(x[0-9A-Fa-f]{2}|.)", token.text, re.DOTALL):
        if match[1] == "x":
            raise FilterError(r"\x takes two hex digits; a backslash is \\", token.column + match.start())


def _spans(token: _Token) -> tuple[Span, ...]:
    spans: list[Span] = []
    for part in token.text.split(","):
        match = _PART.fullmatch(part)
        if match is None or part.strip() == ":":
            raise FilterError(
                f"unreadable slice [{token.text}]: expected [first:count], [first-last] or [place]", token.column
            )
        if match["at"] is not None:
            first = int(match["at"])
            spans.append(Span(first, first + 1 if first != -1 else None))
        elif match["from"] is not None:
            if int(match["to"]) < int(match["from"]):
                raise FilterError(f"slice [{token.text}] ends before it begins", token.column)
            spans.append(Span(int(match["from"]), int(match["to"]) + 1))
        else:
            first = int(match["first"] or 0)
            last = None if match["length"] is None else first + int(match["length"])
            if match["length"] is not None and int(match["length"]) == 0:
                raise FilterError(f"slice [{token.text}] is empty", token.column)
            spans.append(Span(first, None if last == 0 and first < 0 else last))
    return tuple(spans)
