"""Certificates of simulators: does a score that was measured in one mean what it means in the reference simulator?"""
