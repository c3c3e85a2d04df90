"""Time, and what is to happen in it."""

import heapq
from itertools import count

S = 10**12
MS = 10**9
US = 10**6


class Timeline:
    """Picoseconds since power-on, and callbacks at times to come. Never steps back, not over a reset either."""

    def __init__(self):
        self.now = 0
        self._queue = []
        self._numbers = count()

    def at(self, time, callback):
        """The entry may be given to `cancel`."""
        entry = [time, next(self._numbers), callback]
        heapq.heappush(self._queue, entry)
        return entry

    def after(self, duration, callback):
        return self.at(self.now + duration, callback)

    @staticmethod
    def cancel(entry):
        if entry is not None:
            entry[2] = None

    def next(self):
        """When the next callback is due; None without any."""
        while self._queue and self._queue[0][2] is None:
            heapq.heappop(self._queue)
        return self._queue[0][0] if self._queue else None

    def run_due(self):
        while (due := self.next()) is not None and due <= self.now:
            heapq.heappop(self._queue)[2]()

    def pass_by(self, duration):
        """Time in which the processor stands still and everything else goes on."""
        end = self.now + duration
        while (due := self.next()) is not None and due <= end:
            self.now = max(self.now, due)
            self.run_due()
        self.now = max(self.now, end)
