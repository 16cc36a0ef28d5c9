"""Free space at scale: how time, memory and leaves grow, and what other libraries do."""

from hzmp_sim.bench.scale.run import bench_scale as bench_scale
from hzmp_sim.bench.scale.settings import ScaleSettings as ScaleSettings

__all__ = ["ScaleSettings", "bench_scale"]
