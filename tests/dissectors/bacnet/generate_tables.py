"""Write the BACnet tables of dissectors/bacnet from bacpypes3's classes (MIT), which only tests need.

    python tests/dissectors/bacnet/generate_tables.py        writes the four files of `render`

tests/dissectors/bacnet/test_tables.py fails when the committed files and bacpypes3 differ.
"""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import Any

import bacpypes3.apdu as apdu
import bacpypes3.basetypes as basetypes
import bacpypes3.constructeddata as constructed
import bacpypes3.object as objects
import bacpypes3.primitivedata as primitive

FOLDER = Path(__file__).parents[3] / "dissectors/bacnet"

PRIMITIVES = (  # noqa: SIM905
    "Null Boolean Unsigned Integer Real Double OctetString CharacterString BitString Enumerated Date Time "
    "ObjectIdentifier"
).split()
RENAMED = {"Integer": "Signed", "OptionalInteger": "OptionalSigned"}

MISSPELT = {
    "tle-error": "tls-error",
    "who-iam": "who-am-i",
    "who-ami": "who-am-i",
    "property-is-not-alist": "property-is-not-a-list",
    "not-abacnet-sc-hub": "not-a-bacnet-sc-hub",
    "http-not-aserver": "http-not-a-server",
    "performing-abackup": "performing-a-backup",
    "performing-arestore": "performing-a-restore",
    "renew-fd-dregistration": "renew-fd-registration",
    "ansi-x364": "ansi-x3-64",
    "hp70094": "hp-700-94",
    "ibm3130": "ibm-3130",
    "p-h": "ph",
    "micro-siemens": "microsiemens",
    "volts-square-hours": "volt-square-hours",
    "joules-per-hours": "joule-per-hours",
    "ohm-meter-per-square-meter": "ohm-meter-squared-per-meter",
    "wiegand37facility": "wiegand37-facility",
    "facility16card32": "facility16-card32",
    "facility32card32": "facility32-card32",
    "fasc-nbcd": "fasc-n-bcd",
    "fasc-nlarge": "fasc-n-large",
    "fasc-nlarge-bcd": "fasc-n-large-bcd",
}
"""Slips in bacpypes3's names, and words that its capitals do not divide."""

RENUMBERED: dict[str, dict[int, str | None]] = {
    "AbortReason": {64: None, 65: None},  # its own state machine's: from 64 on reasons are the vendors'
    "LockStatus": {3: None},  # "unknown" there, "unused" in the open BACnet stack, where 4 is unknown
    "SecurityLevel": {4: "signed-end-to-end", 5: "encrypted-end-to-end"},  # it gives 4 to both
}
"""Names that bacpypes3 gives to the wrong number, or to a number whose meaning is not sure (None: no name)."""


_PRIMITIVES = (
    "null Null, real Real, unsigned Unsigned, boolean Boolean, integer Signed, double Double, "
    "octet-string OctetString, character-string CharacterString, bit-string BitString, "
    "enumerated Enumerated, date Date, time Time, object-identifier ObjectIdentifier"
)
CORRECTED: dict[str, tuple[str, str]] = {
    "AuditLogRecordLogDatum": (
        "choice",
        "[0] log-status LogStatus, [1] audit-notification AuditNotification, [2] time-change Real",
    ),
    "COVMultipleSubscriptionListOfCOVReference": (
        "sequence",
        "[0] monitored-property PropertyReference, [1]? cov-increment Real, [2]? timestamped Boolean",
    ),
    "COVNotification": (
        "sequence",
        "[0] monitored-object-identifier ObjectIdentifier, [1] list-of-values {COVNotificationValue}",
    ),
    "COVNotificationValue": (
        "sequence",
        "[0] property-identifier PropertyIdentifier, [1]? property-array-index Unsigned, [2] value Any, "
        "[3]? time-of-change Time",
    ),
    "COVSubscriptionFailure": (
        "sequence",
        "[0] monitored-object-identifier ObjectIdentifier, [1] monitored-property-reference PropertyReference, "
        "[2] error-type ErrorType",
    ),
    "EventParameterAccessEvent": (
        "sequence",
        "[0] list-of-access-events {AccessEvent}, [1] access-event-time-reference DeviceObjectPropertyReference",
    ),
    "EventParameterExtendedParameters": ("choice", _PRIMITIVES + ", [0] reference DeviceObjectPropertyReference"),
    "FaultParametersFaultListed": ("sequence", "[0] fault-list-reference DeviceObjectPropertyReference"),
    "NotificationParametersAccessEventType": (
        "sequence",
        "[0] access-event AccessEvent, [1] status-flags StatusFlags, [2] access-event-tag Unsigned, "
        "[3] access-event-time TimeStamp, [4] access-credential DeviceObjectReference, "
        "[5]? authentication-factor AuthenticationFactor",
    ),
    "NotificationParametersChangeOfDiscreteValueType": (
        "sequence",
        "[0] new-value NotificationParametersChangeOfDiscreteValueNewValue, [1] status-flags StatusFlags",
    ),
    "NotificationParametersChangeOfDiscreteValueNewValue": (
        "choice",
        "boolean Boolean, unsigned Unsigned, integer Signed, enumerated Enumerated, character-string CharacterString, "
        "octet-string OctetString, date Date, time Time, object-identifier ObjectIdentifier, [0] date-time DateTime",
    ),
    "NotificationParametersChangeOfStatusFlagsType": (
        "sequence",
        "[0]? present-value Any, [1] referenced-flags StatusFlags",
    ),
    "NotificationParametersChangeOfTimerType": (
        "sequence",
        "[0] new-state TimerState, [1] status-flags StatusFlags, [2] update-time DateTime, "
        "[3]? last-state-change TimerTransition, [4]? initial-timeout Unsigned, [5]? expiration-time DateTime",
    ),
    "NotificationParametersExtended": (
        "sequence",
        "[0] vendor-id Unsigned, [1] extended-event-type Unsigned, "
        "[2] parameters {NotificationParametersExtendedParametersType}",
    ),
    "NotificationParametersExtendedParametersType": (
        "choice",
        _PRIMITIVES + ", [0] property-value DeviceObjectPropertyValue",
    ),
}
"""Layouts as clause 21 of the standard has them, where bacpypes3 0.0.110 differs or has none.

{name: (kind, layout)}
"""

REPLACED: dict[str, tuple[tuple[str, str], ...]] = {
    "NotificationParameters": (
        ("[6] complex-event-type NotificationParametersComplexEventType", "[6] complex-event-type {PropertyValue}"),
        (
            "[19] change-of-reliability NotificationParametersChangeOfReliabilityType",
            "[19] change-of-reliability NotificationParametersChangeOfReliabilityType, "
            "[21] change-of-discrete-value NotificationParametersChangeOfDiscreteValueType, "
            "[22] change-of-timer NotificationParametersChangeOfTimerType",
        ),
    ),
    "NotificationParametersUnsignedRange": (("[2] exceeding-limit", "[2] exceeded-limit"),),
    "AuditLogQueryParametersBySource": (("actions-only Boolean", "actions-only SuccessFilter"),),
    "AuditLogQueryParametersByTarget": (("actions-only Boolean", "actions-only SuccessFilter"),),
    "NameValue": (("value Any", "? value AnyApplication"),),
    "TimeValue": (("value Any", "value AnyPrimitive"),),
    "PropertyStates": (
        ("[370] write-status", "[37] write-status"),
        (
            "[40] lighting-transition LightingTransition",
            "[40] lighting-transition LightingTransition, [41] integer-value Signed, "
            "[42] binary-lighting-value BinaryLightingPV, [43] timer-state TimerState, "
            "[44] timer-transition TimerTransition, [45] bacnet-ip-mode IPMode, "
            "[46] network-port-command NetworkPortCommand, [47] network-type NetworkType, "
            "[48] network-number-quality NetworkNumberQuality, "
            "[49] escalator-operation-direction EscalatorOperationDirection, [50] escalator-fault EscalatorFault, "
            "[51] escalator-mode EscalatorMode, [52] lift-car-direction LiftCarDirection, "
            "[53] lift-car-door-command LiftCarDoorCommand, [54] lift-car-drive-status LiftCarDriveStatus, "
            "[55] lift-car-mode LiftCarMode, [56] lift-group-mode LiftGroupMode, [57] lift-fault LiftFault, "
            "[58] protocol-level ProtocolLevel, [59] audit-level AuditLevel, [60] audit-operation AuditOperation, "
            "[63] extended-value Unsigned",
        ),
    ),
}
"""Parts of layouts of theirs that are replaced, for the same reason."""

DROPPED = {"EventParameterAccessEventAccessEvent", "NotificationParametersComplexEventType"}
"""Types of theirs that the standard does not have."""


def kebab(name: str) -> str:
    """`presentValue` → `present-value`; names that already have hyphens stay."""
    if "-" in name:
        return name.lower()
    name = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1-\2", name)
    name = re.sub(r"([a-z0-9])([A-Z])", r"\1-\2", name).lower()
    return name.replace("success-ful", "successful")


def _names(table: dict[str, int]) -> dict[int, str]:
    """One name a number: the hyphenated spelling where there is one."""
    found: dict[int, str] = {}
    for name, number in table.items():
        if number not in found or "-" in name:
            found[number] = MISSPELT.get(kebab(name), kebab(name))
    return dict(sorted(found.items()))


def enumerations() -> dict[str, dict[int, str]]:
    """Every enumeration: {class name: {number: name}}."""
    classes = [getattr(basetypes, n) for n in dir(basetypes)] + [getattr(primitive, n) for n in dir(primitive)]
    classes += [apdu.ConfirmedServiceChoice, apdu.UnconfirmedServiceChoice, apdu.AbortReason, apdu.RejectReason]
    found = {
        cls.__name__: _names(cls._enum_map)
        for cls in classes
        if isinstance(cls, type) and issubclass(cls, primitive.Enumerated) and cls is not primitive.Enumerated
    }
    for name, corrected in RENUMBERED.items():
        entries = {**found[name], **corrected}
        found[name] = {number: entry for number, entry in entries.items() if entry is not None}
    return dict(sorted(found.items()))


def bit_strings() -> dict[str, dict[int, str]]:
    """Every bit string with named bits: {class name: {bit: name}}."""
    classes = [getattr(basetypes, n) for n in dir(basetypes)]
    found = {
        cls.__name__: _names(cls._bitstring_names)
        for cls in classes
        if isinstance(cls, type) and issubclass(cls, primitive.BitString) and cls is not primitive.BitString
    }
    return dict(sorted(found.items()))


def type_name(cls: Any) -> str:
    """Our name of the type of an element: "Unsigned", "{TimeStamp}", "Any" …"""
    if issubclass(cls, (constructed.Any,)):
        return "Any"
    subtype = getattr(cls, "_subtype", None)
    if subtype is not None and issubclass(cls, (list, constructed.Array, constructed.List)):
        return "{" + type_name(subtype) + "}"
    for base in cls.__mro__:
        name = base.__name__
        known = name in PRIMITIVES or name in _KNOWN
        if known and (base.__module__ or "").startswith("bacpypes3"):
            return RENAMED.get(name, name)
    raise TypeError(f"{cls!r}: no known base")


def _element(name: str, cls: Any) -> str:
    context = getattr(cls, "_context", None)
    optional = "?" if getattr(cls, "_optional", None) else ""
    tag = f"[{context}]{optional} " if context is not None else f"{optional} " if optional else ""
    return f"{tag}{kebab(name)} {type_name(cls)}"


def constructed_types() -> dict[str, tuple[str, str]]:
    """Every sequence and choice of basetypes: {name: (kind, layout)}."""
    found = {}
    for name in sorted(dir(basetypes)):
        cls = getattr(basetypes, name)
        if not (isinstance(cls, type) and issubclass(cls, constructed.Sequence)):
            continue
        if cls in (constructed.Sequence, constructed.Choice) or cls.__name__ != name:
            continue
        choice = issubclass(cls, constructed.Choice)
        order = list(cls._elements) if choice else list(cls._order)
        layout = ", ".join(_element(n, cls._elements[n]) for n in order)
        found[RENAMED.get(name, name)] = ("choice" if choice else "sequence", layout)
    for name, replacements in REPLACED.items():
        kind, layout = found[name]
        for wrong, right in replacements:
            assert wrong in layout, f"{name}: bacpypes3 no longer has {wrong!r}"
            layout = layout.replace(wrong, right)
        found[name] = (kind, layout)
    kept = {name: entry for name, entry in {**found, **CORRECTED}.items() if name not in DROPPED}
    return dict(sorted(kept.items()))


def types_by_object() -> dict[int, dict[int, str]]:
    """{property: {object type: name of its type}} of every standard object."""
    by_property: dict[int, dict[int, str]] = {}
    for cls in vars(objects).values():
        if not (isinstance(cls, type) and issubclass(cls, objects.Object) and cls is not objects.Object):
            continue
        object_type = cls.__dict__.get("objectType")
        if object_type is None:
            continue
        for name, element in cls._elements.items():
            number = int(primitive.PropertyIdentifier(name))
            by_property.setdefault(number, {})[int(object_type)] = type_name(element)
    return by_property


def property_types() -> tuple[dict[int, str], dict[tuple[int, int], str]]:
    """Type by property, the most common one, and by (object type, property) where object types differ at all.

    What objects without the property would mean by it is not said: its type cannot be told from theirs.
    """
    by_property = types_by_object()
    common: dict[int, str] = {}
    special: dict[tuple[int, int], str] = {}
    for number, types in sorted(by_property.items()):
        values = list(types.values())
        common[number] = max(sorted(set(values)), key=values.count)
        if len(set(values)) > 1:
            special |= {(object_type, number): name for object_type, name in sorted(types.items())}
    return common, special


_KNOWN = {
    cls.__name__
    for module in (basetypes, primitive)
    for cls in vars(module).values()
    if isinstance(cls, type)
    and issubclass(cls, (primitive.Enumerated, primitive.BitString, constructed.Sequence))
    and cls not in (primitive.Enumerated, primitive.BitString, constructed.Sequence, constructed.Choice)
} | {"DateTime"}

_HEADING = """\"\"\"{what}.

Generated by tests/dissectors/bacnet/generate_tables.py from bacpypes3's tables: do not edit.
\"\"\"
"""


def _packed(tables: dict[str, dict[int, str]]) -> str:
    lines = []
    for name, entries in tables.items():
        text = " ".join(f"{number} {entry}" for number, entry in entries.items())
        body = textwrap.fill(text, 112, initial_indent=" " * 8, subsequent_indent=" " * 8, break_on_hyphens=False)
        lines.append(f'    "{name}": _table(\n        """\n{body}\n        """\n    ),\n')
    return "".join(lines)


_TABLE = """
from __future__ import annotations


def _table(text: str) -> dict[int, str]:
    words = text.split()
    return {int(number): name for number, name in zip(words[::2], words[1::2], strict=True)}


"""


def render() -> dict[str, str]:
    """The files: {name: text}."""
    common, special = property_types()
    plain = "".join(f"    {number}: {_quoted(name)},\n" for number, name in common.items())
    by_object = "".join(f"    ({t}, {p}): {_quoted(name)},\n" for (t, p), name in special.items())
    layouts = {"sequence": "", "choice": ""}
    for name, (kind, layout) in constructed_types().items():
        line = f"    {_quoted(name)}: {_quoted(layout)},\n"
        if len(line) > 121:
            fits = len(layout) <= 110
            parts = [layout] if fits else textwrap.wrap(layout, 100, break_on_hyphens=False)
            inner = "".join(
                f"        {_quoted(part + (' ' if n < len(parts) else ''))}\n" for n, part in enumerate(parts, 1)
            )
            line = f"    {_quoted(name)}: (\n{inner}    ),\n"
        layouts[kind] += line
    return {
        "enumerations.py": _HEADING.format(what="BACnet enumerations and named bits")
        + _TABLE
        + "ENUMERATIONS: dict[str, dict[int, str]] = {\n"
        + _packed(enumerations())
        + "}\n\nBIT_STRINGS: dict[str, dict[int, str]] = {\n"
        + _packed(bit_strings())
        + "}\n",
        "sequences.py": _HEADING.format(what="BACnet sequences in the notation of layout.py")
        + "\nfrom __future__ import annotations\n\nSEQUENCES: dict[str, str] = {\n"
        + layouts["sequence"]
        + "}\n",
        "choices.py": _HEADING.format(what="BACnet choices in the notation of layout.py")
        + "\nfrom __future__ import annotations\n\nCHOICES: dict[str, str] = {\n"
        + layouts["choice"]
        + "}\n",
        "property_types.py": _HEADING.format(what="The type of each BACnet property")
        + "\nfrom __future__ import annotations\n\nPROPERTY_TYPES: dict[int, str] = {\n"
        + plain
        + "}\n\nBY_OBJECT: dict[tuple[int, int], str] = {\n"
        + by_object
        + '}\n"""(object type, property) of those properties whose type depends on the object."""\n\n'
        + "VARYING = frozenset(number for _, number in BY_OBJECT)\n",
    }


def _quoted(text: str) -> str:
    return '"' + text + '"'


if __name__ == "__main__":
    for name, text in render().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(f"{name}: {len(text.splitlines())} lines")
