"""How well does the arm move, and is what is in its way found?"""
