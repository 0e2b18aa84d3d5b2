"""What one can ask of a robot by its role: functions of a peer, which give a ticket; and the table of the roles."""
