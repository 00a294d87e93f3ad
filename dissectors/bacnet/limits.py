"""Times and sizes of MS/TP (ANSI/ASHRAE 135, 9.5.3 and 9.3). Times in ns unless the name says bits or octets."""

from __future__ import annotations

from dissectors.line import MS as MS

T_NO_TOKEN = 500 * MS  # silence after which the token counts as lost
T_SLOT = 10 * MS  # back-off slot, times the node's own address, before it makes a new token
T_ALL_SILENT = 2_000 * MS  # T_NO_TOKEN and a slot for each address, and some: no master that is alive waits so long
T_REPLY_DELAY = 250 * MS  # a node must answer a request, or postpone, within
T_REPLY_TIMEOUT = 255 * MS  # shortest wait of the one who asked (255 … 300)
T_REPLY_TIMEOUT_MAX = 300 * MS
T_USAGE_DELAY = 15 * MS  # a new token holder must begin to send, and a polled master to answer, within
T_USAGE_TIMEOUT = 20 * MS  # shortest wait for the next node to use the token or to answer a poll (20 … 35)
T_USAGE_TIMEOUT_MAX = 35 * MS  # older texts allow 100
T_FRAME_ABORT_MAX = 100 * MS  # longest gap after which a receiver may still keep a partial frame

TURNAROUND_BITS = 40  # least silence before a node may drive the line
FRAME_GAP_BITS = 20  # longest gap inside a frame by its sender
FRAME_ABORT_BITS = 60  # shortest gap after which a receiver may drop a partial frame
POSTDRIVE_BITS = 15  # the driver is off after the last stop bit within

N_POLL = 50  # tokens received between two polls for masters
N_RETRY_TOKEN = 1  # repeats of a token that nobody used
N_MIN_OCTETS = 4  # octets that prove that somebody used the token
MAX_MASTER = 127  # highest address of a master, and the default of Max_Master
BROADCAST = 255

MAX_DATA = 501  # octets of data in a frame that is not encoded
MAX_ENCODED = 2043  # the largest length field of an encoded frame
MIN_ENCODED = 5  # the smallest one
MAX_NPDU = 1497  # octets of NPDU in an encoded frame
