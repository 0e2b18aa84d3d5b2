"""Keys that robots and hosts sign with: their files, and how a robot gets one."""
