"""Names for places in a flat array."""


class Layout:
    """Hands out places one after the other; `width` numbers stand in each field."""

    def __init__(self, width: int = 1) -> None:
        self._width = width
        self._end = 0

    def take(self, fields: int) -> int:
        """Return the offset of the first of that many fields."""
        offset = self._end
        self._end += fields * self._width
        return offset

    @property
    def size(self) -> int:
        """Length of the array, in whole vectors of eight."""
        return (self._end + 7) // 8 * 8
