"""`hzmp-sim bench peers`: other planners on the same scenes, in the same run."""
