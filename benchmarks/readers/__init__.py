"""What do readers make of files that others wrote?"""
