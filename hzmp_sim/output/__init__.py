"""What a run leaves behind: metrics, log, recording, video, figures, report.

`write` and what it writes with (rerun, matplotlib, OpenGL) are imported by those who write.
"""

from hzmp_sim.output.artifacts import OutputError as OutputError
from hzmp_sim.output.artifacts import RunDirectory as RunDirectory

__all__ = ["OutputError", "RunDirectory"]
