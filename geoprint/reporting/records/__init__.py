"""The typed layouts of plan.json and compare.json, from which everything else that is said takes its figures."""
