"""What `hil monitor` shows on a terminal: pictures as plain data, and the one place that touches Textual."""
