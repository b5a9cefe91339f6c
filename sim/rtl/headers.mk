# Beside Verilator's rules for a model: headers that are compiled ahead, and what only the model's own code is compiled with.
# HEADERS is the file that includes them, MAIN the main program, compiled with the model.

$(VM_PREFIX)__ALL.o: OPT_FAST = -include $(HEADERS) -include $(MAIN)
# A cache of compiled code serves Verilator's runtime; models are kept by their content already.
$(VM_PREFIX)__ALL.o: OBJCACHE =

# An interrupted run leaves no half of it.
$(HEADERS).gch: $(HEADERS)
	$(CXX) $(CXXFLAGS) $(CPPFLAGS) -x c++-header -c -o $@.new $< && mv $@.new $@
