"""What is said of a result: plan.json and compare.json, tables, verdict, run sheet, report and pictures."""
