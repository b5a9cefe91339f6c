"""The doors of axes: what lets a drive out in its axis's turn, and shuts at once, in between, when a loop opens."""

from amaranth.hdl import Cat, Mux, Signal, Value
from amaranth.lib.data import ArrayLayout

from .pipe import Pipe
from .supervisor import Judged


class Doors:
    """A door for every axis. It is shut from the clock in which a loop is open until a turn has seen this.

    Such a turn lets out nothing: it finds a low enable or a standing cause. Turns that had looked before may still
    decide to let something out: none of them comes later than the next look.

    Args:
        pipe: the pipeline.
        levels: the synchronised levels of the loops, by name, a bit for each axis.
        watches: for every axis, whether its loop of external_fault acts.
        look: the stage in which a turn looks.

    Attributes:
        waiting: for every loop by its name, and for every axis, whether it was open since its last turn.
        magnitude, negative: the drive that is let out.
        armed: whether it may be other than zero.
        alive: a square wave while it may.
        drive_inverted: whether the sign of the drive's pins is to be reversed.
    """

    def __init__(self, pipe: Pipe, levels: dict[str, Signal], watches: Value, look: int):
        self._pipe = pipe
        opened = {
            "drive_enable": ~levels["drive_enable"],
            "emergency_stop": ~levels["emergency_stop"],
            "external_fault": ~levels["external_fault"] & watches,
        }
        self.waiting = {name: pipe.waits(name, each, look) for name, each in opened.items()}
        self._shut = [
            Cat(each[axis] for each in (*opened.values(), *self.waiting.values())).any() for axis in range(pipe.axes)
        ]
        self.negative = Signal(pipe.axes)
        self.armed = Signal(pipe.axes)
        self.alive = Signal(pipe.axes)
        self.drive_inverted = Signal(pipe.axes)

    def let_out(self, judged: Judged, wave: Value, invert: Value, stage: int) -> None:
        """Let out the drive that a turn allows, in that stage.

        Args:
            judged: what it decides.
            wave: a square wave that runs freely.
            invert: whether the host wants the sign reversed.
            stage: the stage.
        """
        m = self._pipe.m
        self.magnitude = Signal(ArrayLayout(judged.magnitude.shape(), self._pipe.axes))
        for axis, (turn, shut) in enumerate(zip(self._pipe.turns(stage), self._shut, strict=True)):
            drives = Mux(turn, judged.drives, self.armed[axis]) & ~shut
            m.d.sync += [self.armed[axis].eq(drives), self.alive[axis].eq(drives & wave)]
            with m.If(turn):
                m.d.sync += [self.magnitude[axis].eq(judged.magnitude), self.negative[axis].eq(judged.negative)]
            with m.If(turn & ~judged.was_armed):
                m.d.sync += self.drive_inverted[axis].eq(invert)
            with m.If(shut):
                m.d.sync += [self.magnitude[axis].eq(0), self.negative[axis].eq(0)]
