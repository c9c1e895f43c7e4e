"""How even are paths, and how right are the distances and fields they follow?"""
