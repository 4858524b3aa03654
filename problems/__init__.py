"""Robot problems: reusable modules, gaits, terrains, robots, and one folder per problem family."""
