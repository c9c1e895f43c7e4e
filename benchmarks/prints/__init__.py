"""What do photographs and scans show of prints, and what does a print learn from them?"""
