"""Link, pump, codec and peers behind one single-threaded `step()`, and all that it takes in."""
