"""Learning rules: one file each."""

from agents.learning.aggregate_label import AggregateLabel
from agents.learning.chronotron import Chronotron
from agents.learning.critical_threshold import CriticalThreshold
from agents.learning.error_trace import ErrorTrace
from agents.learning.mpdal import MPDAL
from agents.learning.mstdpet import MSTDPET
from agents.learning.peak_error import PeakError
from agents.learning.policy_gradient import PolicyGradient
from agents.learning.psd import PSD
from agents.learning.resume import ReSuMe
from agents.learning.span import SPAN
from agents.learning.stdp import STDP
from agents.learning.surrogate_gradient import SurrogateGradient
from agents.learning.tempotron import Tempotron

__all__ = [
    "MPDAL",
    "MSTDPET",
    "PSD",
    "SPAN",
    "STDP",
    "AggregateLabel",
    "Chronotron",
    "CriticalThreshold",
    "ErrorTrace",
    "PeakError",
    "PolicyGradient",
    "ReSuMe",
    "SurrogateGradient",
    "Tempotron",
]
