"""What a report tells of several coachings, of which one advice was made."""
