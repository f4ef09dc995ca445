"""Shape to fields: domain, screened operator, solvers and the hyperfield over ρ."""
