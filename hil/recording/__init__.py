"""The recorder in a process of its own: the control process hands over what there is to write, and goes on."""
