"""What does a written program deposit, and where does it lead?"""
