"""What a run leaves behind: metrics, log, recording, video, figures, report."""

from hzmp_sim.output.artifacts import OutputError as OutputError
from hzmp_sim.output.artifacts import RunDirectory as RunDirectory
from hzmp_sim.output.opengl import RenderingUnavailable as RenderingUnavailable
from hzmp_sim.output.video import VideoError as VideoError
from hzmp_sim.output.write import write_run as write_run

__all__ = ["OutputError", "RenderingUnavailable", "RunDirectory", "VideoError", "write_run"]
