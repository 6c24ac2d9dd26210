"""What the commands share: options, how they read, what they print, how they end."""
