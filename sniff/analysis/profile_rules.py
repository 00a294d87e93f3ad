"""The rules of device profiles: what each finds, against which limit, and what to check next."""

from __future__ import annotations

from dissectors.findings import Rule, Severity

WRITTEN_BEYOND = "the wrong profile, or a scale, unit or limit in the master that is not the device's"
WRITTEN_NEXT = "compare the device with its profile (`profile guess`), then this value in the master"
"""What PR001 means of a value that was written: the device has no part in it."""

_REFUSED = ("MB008", "N2009", "MS305")
"""What a station says to a request that it cannot carry out."""

PROFILE_RULES: dict[str, Rule] = {
    rule.code: rule
    for rule in (
        Rule(
            "PR001",
            Severity.WARNING,
            "value out of range",
            "A value that a station answered, or that was written to it, lies outside the range that its profile gives "
            "(from the manual of the device).",
            "the wrong profile, a setting beyond the device, or a failed sensor",
            "compare the device with its profile (`profile guess`), then look at the setting",
            explains_there=_REFUSED,
        ),
        Rule(
            "PR002",
            Severity.WARNING,
            "write to a reserved register",
            "A master writes to a register that the maker keeps for itself. The TECO manuals say not to (1.0.2).",
            "the master's register list does not fit this device, or counts from 1 where it should count from 0",
            "compare the master's register numbers with the device's table",
            explains_there=_REFUSED,
        ),
        Rule(
            "PR003",
            Severity.WARNING,
            "write to what is read only",
            "A master writes to a register or object that can only be read.",
            "the master's list does not fit this device, or the wrong station is asked",
            "compare the master's list with the device's table",
            explains_there=_REFUSED,
        ),
        Rule(
            "PR004",
            Severity.ERROR,
            "device reports a fault",
            "A station answered a fault code or a trip bit other than none, worded as in its manual, or the bit or "
            "state of a status word that stands for any fault.",
            "the device has stopped, or will not start, because of it",
            "look the fault up in the device's manual; reset it when its cause is gone",
        ),
        Rule(
            "PR005",
            Severity.WARNING,
            "device reports an alarm",
            "A station answered an alarm code or warning bit other than none, worded as in its manual, or the bit or "
            "state of a status word that stands for any warning.",
            "the device runs on, but not as it should",
            "look the alarm up in the device's manual",
        ),
        Rule(
            "PR006",
            Severity.WARNING,
            "frame longer than the device takes",
            "A frame to or from a station has more octets on the line than its manual allows (TECO E510 and F510 over "
            "registers: 80, manual 1.0.1).",
            "a master that reads or writes too much at once",
            "have the master read fewer registers in one request",
            explains_there=_REFUSED,
        ),
        Rule(
            "PR007",
            Severity.NOTE,
            "slower than the device promises",
            "Answers came later than the response time that the manual gives (TECO E510 and F510 over registers: "
            "10 ms, 1.0.1), even when all that the adapter may have added is taken off.",
            "a response delay that is set in the device, a device busy with other work, or a gateway in between",
            "allow for it in the master's timeout; look at the device's response delay setting",
        ),
        Rule(
            "PR008",
            Severity.WARNING,
            "write to reserved bits",
            "A master writes 1 into bits of a command that the maker keeps for itself. The TECO manuals ask for 0 "
            "there (1.0.2).",
            "the master's bits do not fit this device",
            "compare the master's command word with the device's table",
            explains_there=_REFUSED,
        ),
        Rule(
            "PR009",
            Severity.NOTE,
            "function that the device does not have",
            "A master asks with a function code that the device's manual does not list.",
            "the wrong profile, or a master that tries what the device refuses",
            "have the master use a function of the device",
        ),
        Rule(
            "PR010",
            Severity.WARNING,
            "acknowledged and not executed",
            "A station acknowledged a command that its manual says it answers without doing anything.",
            "the master believes that it was obeyed: what it released still stands, what it commanded never came",
            "have the master command what the device executes; release by overriding with the value that is wanted",
            explains=("N2006",),
        ),
        Rule(
            "PR011",
            Severity.NOTE,
            "property other than in the manual",
            "A station answered a name or unit of an object that its manual gives otherwise, or a vendor name, an "
            "ident number or a model code of another device.",
            "another software version of the device, the wrong profile, or somebody renamed the object",
            "compare the device with its profile (`profile guess`)",
        ),
        Rule(
            "PR012",
            Severity.NOTE,
            "number that the device cannot be given",
            "A station answered under a number outside the range that the manual of its device gives.",
            "the wrong profile, or another device than the plan says",
            "compare the device with its profile (`profile guess`)",
        ),
        Rule(
            "PR013",
            Severity.NOTE,
            "written while the device runs",
            "A master writes what the device's manual lets it write only while it is stopped, within ten seconds of an "
            "answer that said that it runs, and no command in between.",
            "the device refuses it, or takes it without doing it; or it was stopped at its own keypad meanwhile",
            "stop the device first; then read back what was written",
        ),
    )
}
