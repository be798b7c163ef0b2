"""What the numbers were measured on: processor, cores, load and versions; no names, no paths."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from llvmlite import binding

from agents.experiments import provenance
from benchmarks.cores import Cores

PACKAGES = (
    "numpy",
    "numba",
    "llvmlite",
    "gymnasium",
    "scipy",
    "torch",
    "stable-baselines3",
    "snntorch",
    "norse",
)


def machine(cores: Cores) -> dict[str, Any]:
    """The machine and the software, for JSON."""
    return {
        "processor": _processor(),
        "instructions": binding.get_host_cpu_name(),
        "logical_cores": os.cpu_count(),
        "cores_measured_on": cores.count,
        "pinned": cores.can_pin,
        "memory_gib": _memory(),
        "load_before": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: found for name in PACKAGES if (found := _version(name))},
        "software": provenance.software(),
        "commit": provenance.commit()[:12],
    }


def _processor() -> str:
    """The processor's own name for itself, with its family and model, which say more."""
    try:
        first = Path("/proc/cpuinfo").read_text().partition("\n\n")[0]
    except OSError:
        return platform.processor() or platform.machine()
    about = dict(line.split(":", 1) for line in first.splitlines() if ":" in line)
    facts = {key.strip(): value.strip() for key, value in about.items()}
    name = facts.get("model name", platform.machine())
    if "cpu family" in facts:
        name += f" (family {facts['cpu family']}, model {facts.get('model', '?')})"
    return name


def _memory() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, OSError, ValueError):
        return None


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
