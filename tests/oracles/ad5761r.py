"""An AD5761R, as its data sheet (AD5761R/AD5721R, Rev. C) and its maker's driver describe it, seen from its pins."""

FRAME_BITS, COMMAND_AT, ZERO_AT = 24, 16, 20
WRITES_DAC, WRITES_CONTROL, RESETS = 0x3, 0x4, 0xF
REFERENCE_V = 2.5
RANGES = {0: (-4, 8), 1: (0, 4), 2: (-2, 4), 3: (0, 2), 4: (-1, 4), 5: (-1.2, 2.4), 6: (0, 6.4), 7: (0, 8)}
"""By the bits RA: the lowest output and the span, in references."""
SCALES = {0: 0, 1: 1 << 15, 2: (1 << 16) - 1}
"""By the bits PV, or CV: zero scale, middle, full scale."""


class Ad5761r:
    """The DAC with LDAC low, and `RESET` and not `CLEAR` wired.

    Attributes:
        code: the code of its output, straight binary.
        overrange: whether its range is 5 % more than it is called.
    """

    def __init__(self):
        self._bits, self._sclk, self._sync_n = "", 0, 1
        self._reset()

    def _reset(self) -> None:
        self.code, self._range, self.overrange = 0, None, False

    @property
    def volts(self) -> float:
        """The output, which is held at ground until the control register is written."""
        if self._range is None:
            return 0.0
        low, span = RANGES[self._range]
        return REFERENCE_V * (low + span * self.code / (1 << 16)) * (1.05 if self.overrange else 1.0)

    def see(self, sync_n: int, sclk: int, sdi: int, reset_n: int) -> None:
        """Look at the pins, at least once between two changes of one."""
        if not sync_n and self._sclk and not sclk:
            self._bits += str(sdi)
        if sync_n:
            if not self._sync_n and len(self._bits) == FRAME_BITS:
                self._take(int(self._bits, 2))
            self._bits = ""
        self._sclk, self._sync_n = sclk, sync_n
        if not reset_n:
            self._reset()

    def _take(self, frame: int) -> None:
        command, data = frame >> COMMAND_AT & 0xF, frame & 0xFFFF
        assert not frame >> ZERO_AT & 1
        if command == RESETS:
            self._reset()
        elif command == WRITES_CONTROL:
            assert data >> 5 & 1, "the internal reference is off"
            assert not data >> 7 & 1, "codes are two's complement"
            self._range, self.overrange, self.code = data & 7, bool(data >> 8 & 1), SCALES[data >> 3 & 3]
        else:
            assert command == WRITES_DAC
            self.code = data
