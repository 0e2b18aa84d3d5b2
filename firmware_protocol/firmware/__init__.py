"""The robot's firmware: portable C in `core/`, one folder per board in `targets/`, and what the host build of it is made of."""
