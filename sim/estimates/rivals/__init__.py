from ....model.runtime.extras import need

need("sim")
