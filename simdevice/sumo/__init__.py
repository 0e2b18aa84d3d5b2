"""The sumo ring: its measures, the dummies, the referee, and worlds to play bouts in."""
