"""One remote robot: its connection, questions that are repeated until they are answered, link quality."""
