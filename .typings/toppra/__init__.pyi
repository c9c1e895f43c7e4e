from toppra import algorithm as algorithm
from toppra import constraint as constraint
