"""The robot's firmware: portable C in `core/`, one folder per board in `targets/`, and the host build of it, `_host`."""
