"""Deals with the process: threads, progress bars, whole files, interrupts, the entry of every solve."""
