"""The stages of a datapath as dataflow graphs: second-order sections in every structure, polynomial, output."""
