"""One sentence in place of an illegal instruction. Imported before the compiled part."""

from pathlib import Path

from ._build import ARCHITECTURE


def lacks(architecture: str, cpuinfo: str) -> bool:
    """Whether a processor, as /proc/cpuinfo describes it, is older than what a package was built for."""
    flags = next((line.split() for line in cpuinfo.splitlines() if line.startswith("flags")), None)
    return architecture == "x86-64-v3" and flags is not None and not {"avx2", "bmi2", "fma"} <= set(flags)


_cpuinfo = Path("/proc/cpuinfo")
if lacks(ARCHITECTURE, _cpuinfo.read_text() if _cpuinfo.exists() else ""):
    raise ImportError("touchstone was built for processors with AVX2 and FMA (x86-64-v3), and this one is older: build it here with 'pip install .'")
