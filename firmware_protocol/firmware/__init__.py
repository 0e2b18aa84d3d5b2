"""The robot's firmware: portable C in `core/`, one folder per role beside it, one per board in `targets/`.

And what the host build of it is made of.
"""
