"""`python -m hzmp_sim` is `hzmp-sim`."""

from hzmp_sim.cli import main

main()
