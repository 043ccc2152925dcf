"""What bipot.pictures draws, a subject a file; made of matplotlib but for interactive."""
