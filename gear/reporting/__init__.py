"""Progress of long calls: bars in terminals and notebooks, plain lines in log files."""
