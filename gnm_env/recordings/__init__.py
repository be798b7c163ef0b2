"""Recorded spikes as `Trials`: one file for each format, whose library is imported only when used.

| what you have                                    | function        | extra      |
| ------------------------------------------------ | --------------- | ---------- |
| spike times or rasters in arrays                 | `gnm_env.Trial` | none       |
| Neo Block or Segments, hence what Neo can read   | `from_neo`      | `neo`      |
| NWB file with units and trials                   | `from_nwb`      | `nwb`      |
| pynapple TsGroup and IntervalSet                 | `from_pynapple` | `pynapple` |
| HDF5 as SHD and SSC have it                      | `from_hdf5`     | `hdf5`     |
| structured arrays of events, as tonic gives them | `from_events`   | none       |
| text with a row for each spike                   | `from_csv`      | none       |
| nothing yet: a recording to try                  | `grasshopper`   | `nitime`   |

All of them put times into bins of `bin_width`, and find what a trial is owed by a function of yours
or by the name of a column.
"""

from gnm_env.recordings.csv import from_csv
from gnm_env.recordings.events import from_events
from gnm_env.recordings.hdf5 import from_hdf5
from gnm_env.recordings.neo import from_neo
from gnm_env.recordings.nitime import grasshopper
from gnm_env.recordings.nwb import from_nwb
from gnm_env.recordings.pynapple import from_pynapple

__all__ = [
    "from_csv",
    "from_events",
    "from_hdf5",
    "from_neo",
    "from_nwb",
    "from_pynapple",
    "grasshopper",
]
