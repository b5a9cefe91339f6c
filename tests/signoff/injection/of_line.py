"""Faults of the serial line: frames that must not be taken."""

from hardwall.model.link.line import GAP_S, framed
from hardwall.testing import rng
from stimuli import frames

from .fault import UNCHANGED, Fault, trips
from .of_host import QUICK, SILENT, beats, heard, line_mended
from .rig import Rig
from .scene import REGISTERS
from .serial_host import bits

GAP_MS = 1e3 * GAP_S + 0.1
DISARM = frames.write_one(REGISTERS["disarm"].address, 1)
"""The request that would show best that it was taken: the drive would be zero."""
NOISE_BYTES = 200


def hears(data: bytes):
    """Return the fault that the board hears some bytes, which it must not answer."""

    async def inject(rig: Rig) -> None:
        # A heartbeat behind it would be taken for its end.
        rig.host.beats = False
        answer = await rig.host.exchange(data)
        rig.claim(not answer, f"the answer is {answer.hex(' ')}")
        await rig.run(GAP_MS)
        await rig.host.heartbeat()

    return inject


async def every_flip(rig: Rig) -> None:
    """Flip every bit of a frame on the line in turn, its start and stop bits too."""
    host = rig.host
    host.beats = False
    levels = bits(framed(b"\1" + DISARM))
    for place in range(len(levels)):
        await host.send([level ^ (place == k) for k, level in enumerate(levels)])
        await rig.run(GAP_MS)
        await host.heartbeat()
        rig.claim(host.beat == await host.read("heartbeat"), f"the frame after the flip of bit {place} is lost")
    errors = await host.read("link_errors")
    rig.claim(errors == len(levels), f"{errors} frames were dropped of {len(levels)}")


async def a_broadcast(rig: Rig) -> None:
    """Ask all units to disarm."""
    await hears(framed(b"\0" + DISARM))(rig)
    rig.claim(await rig.host.read("link_unanswered") == 1, "the broadcast is not counted")


async def never_pauses(rig: Rig) -> None:
    """Cut a frame short, and go on to beat every 10 ms: the line never rests for the 20 ms that would end it."""
    host = rig.host
    await heard(beats)(rig)
    host.beats = False
    await host.exchange(framed(b"\1" + DISARM)[:5])
    for _ in range(6):
        await rig.run(8)
        host.beat += 1
        answer = await host.exchange(framed(b"\1" + host.writing(heartbeat=host.beat)))
        rig.claim(not answer, f"the answer is {answer.hex(' ')}")


def noise() -> bytes:
    """Return bytes that are no frame."""
    return bytes(rng().integers(0, 256, NOISE_BYTES, dtype="u1"))


FAULTS = (
    Fault("each bit of a frame flips in turn, 80 of them", every_flip, UNCHANGED),
    Fault("a frame is cut short", hears(framed(b"\1" + DISARM)[:5]), UNCHANGED),
    Fault(
        "a frame is cut short, and the host beats every 10 ms (supervisor_watchdog 50 ms)",
        never_pauses,
        trips("link_timeout", within=SILENT),
        line_mended,
        live=QUICK,
    ),
    Fault("a frame has a bad CRC", hears(b"\1" + DISARM + b"\0\0"), UNCHANGED),
    Fault("a frame is for another unit", hears(framed(b"\2" + DISARM)), UNCHANGED),
    Fault("a frame is a broadcast", a_broadcast, UNCHANGED),
    Fault("200 bytes of noise on the line", hears(noise()), UNCHANGED),
)
