"""What holds bodies and acts on them: supports, loads, contact, water."""
