"""What is asked for, and how it is divided: studies and plans. Nothing is computed here."""
