"""The experiments and figures of the HZ-MP paper (Xie, Betz and Alanwar 2026), run again."""
