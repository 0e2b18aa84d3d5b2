"""What `hil monitor` knows of the robots that it watches, and what keys ask of them."""
