# Verilator's rules for its runtime, and one compilation for the hardware with its shim: the headers of Verilator, which
# take as long to read as the code of an axis, are read once.

include $(PREFIX).mk
CXXFLAGS += -fPIC -fno-semantic-interposition

library.so: ../$(SHIM) $(PREFIX)__ALL.cpp $(VK_GLOBAL_OBJS)
	$(CXX) $(CXXFLAGS) $(CPPFLAGS) $(OPTIMISATION) -shared -o $@ $< $(VK_GLOBAL_OBJS) $(LDFLAGS) $(LDLIBS)
