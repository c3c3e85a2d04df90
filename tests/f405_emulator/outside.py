"""What is wired to the chip: the encoders, the LVDT, the host."""

from .timeline import S, US

# The pins of port B with the index of each joint.
INDEX_PINS = (8, 9, 12, 13, 14, 15)
# What the converter sees: a conditioner that stands at its rail, as without a bar, and its middle.
SIGNAL_CHANNEL, LAST_STEP, MID_SCALE = 10, 4095, 2048


class Outside:
    """A robot that stands still, an LVDT without a bar, and index lines that may ring."""

    def __init__(self, chip):
        self._chip = chip
        self._ringing = {}
        self.to_host = bytearray()
        for pin in INDEX_PINS:
            self._set(pin, False)

    def counts(self, _joint):
        return 0

    def steps(self, channel):
        return LAST_STEP if channel == SIGNAL_CHANNEL else MID_SCALE

    def on_link_bytes(self, data):
        self.to_host += data

    def take_link_bytes(self):
        data = bytes(self.to_host)
        self.to_host.clear()
        return data

    # ---- index lines

    def ring(self, joint, pulses_per_s, high_ns):
        """Pulses without end on a joint's index line, until `quiet`."""
        self.quiet(joint)
        period, high = S // pulses_per_s, high_ns * US // 1000
        pin = INDEX_PINS[joint]

        def rise():
            self._set(pin, True)
            self._ringing[joint] = self._chip.timeline.after(high, fall)

        def fall():
            self._set(pin, False)
            self._ringing[joint] = self._chip.timeline.after(period - high, rise)

        rise()

    def quiet(self, joint):
        self._chip.timeline.cancel(self._ringing.pop(joint, None))
        self._set(INDEX_PINS[joint], False)

    def _set(self, pin, is_high):
        port = self._chip.gpio["B"]
        was_high = not port.driven_low >> pin & 1
        port.driven_low = port.driven_low & ~(1 << pin) | (0 if is_high else 1 << pin)
        if is_high != was_high:
            self._chip.exti.edge(pin, is_high)
