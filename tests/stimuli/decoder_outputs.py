"""A decoder's outputs made by hand, edge by edge, for estimators that use stamps."""

from hardwall.model.estimators.estimate import EstimatorDesign


class Scale:
    """A decoder's outputs, made by hand: edges pass, time goes by, and both count and stamps wrap."""

    def __init__(self, d: EstimatorDesign, now: int = 0, count: int = 0):
        self.d, self.now, self.count = d, now, count
        self.stamps, self.edge, self.down, self.run = [0] * 4, 0, 0, 0
        self._half, self._mask = 1 << (d.count_width - 1), (1 << d.stamp_width) - 1

    def pass_edge(self, up: bool, at: int) -> None:
        self.run = min(self.run + 1, 4) if self.down != up else 1
        self.down = int(not up)
        self.count += 1 if up else -1
        self.edge = (self.count + self.down) & 3 ^ self.down << 1
        self.stamps[self.edge] = at & self._mask

    def pass_all_but_four(self, up: bool, edges: int) -> int:
        """Pass the first of many edges in one direction, which the last four leave no trace of; return their number."""
        first = max(edges - 4, 0)
        self.count += first if up else -first
        return first

    def row(self) -> tuple[int, ...]:
        half = self._half
        count = (self.count + half) % (2 * half) - half
        return (count, self.now & self._mask, *self.stamps, self.edge, self.down, self.run)
