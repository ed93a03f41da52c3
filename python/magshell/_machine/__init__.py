"""What of the computer and of this process the library uses: threads, files, memory, progress, interrupts."""
