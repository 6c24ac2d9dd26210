"""What both packages stand on: modules here know neither grids nor signs and import neither
package.
"""
