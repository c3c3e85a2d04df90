"""The image: what the linker made."""

from bisect import bisect_right

from elftools.elf.elffile import ELFFile


class Image:
    """Bytes with their addresses, and the names of functions."""

    def __init__(self, path):
        with open(path, "rb") as file:
            elf = ELFFile(file)
            loaded = (s for s in elf.iter_segments("PT_LOAD") if s["p_filesz"])
            self.segments = [(segment["p_paddr"], segment.data()) for segment in loaded]
            symbols = elf.get_section_by_name(".symtab").iter_symbols()
            functions = sorted((s["st_value"] & ~1, s.name) for s in symbols if s["st_info"]["type"] == "STT_FUNC")
        self._starts = [start for start, _ in functions]
        self._names = [name for _, name in functions]

    def name(self, address):
        """The function around an address, and the address."""
        at = bisect_right(self._starts, address)
        return f"{self._names[at - 1] if at else '?'} ({address:#010x})"

